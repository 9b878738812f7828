% SPDX-License-Identifier: Apache-2.0
% The conformance set through nf_insertion; README.md describes a case. Without solids and needles that bend.
1;
function x = number(word)
  x = str2double(word);
end
function value = with_numbers(value, words)
  for i = 1:2:numel(words) - 1
    if strcmp(words{i}, 'equivalence')
      value.equivalence = words{i + 1};
    else
      value.(words{i}) = number(words{i + 1});
    end
  end
end
function show(s)
  phases = {'free', 'deformation', 'insertion', 'hold', 'extraction'};
  statuses = {'ok', 'outside_range', 'invalid_parameter', 'not_finite'};
  numbers = [s.depth, s.velocity, s.force, s.stiffness, s.friction, s.cutting, s.lateral, s.force_by_depth, ...
             s.force_by_velocity, s.phase, s.status, s.contact, s.punctured, s.exit];
  text = sprintf([repmat('%.17g ', 1, 9) 'phase%d status%d %d %d %d\n'], numbers');
  for i = 1:numel(phases)
    text = strrep(text, sprintf('phase%d', i - 1), phases{i});
  end
  for i = 1:numel(statuses)
    text = strrep(text, sprintf('status%d', i - 1), statuses{i});
  end
  printf('%s', text);
end
function v = velocity(word)
  if strcmp(word, '-')
    v = [];
  else
    v = number(word);
  end
end
function say(taken)
  answers = {'refused', 'taken'};
  printf('%s\n', answers{taken + 1});
end
function trace_case(path)
  printf('case %s\n', path);
  layers = {};
  settings = struct();
  handle = NaN;
  ticks = 0;
  for line = strsplit(fileread(path), "\n")
    w = strsplit(strtrim(line{1}), ' ');
    what = w{1};
    if isempty(what) || what(1) == '#'
      continue
    end
    switch what
      case 'layer'
        layers{end + 1} = struct('top', number(w{2}));
      case 'set'
        settings.(w{2}) = number(w{3});
      case {'stiffness', 'puncture', 'friction', 'cutting', 'relaxation'}
        layers{end}.(what) = with_numbers(struct('name', w{2}), w(3:end));
      case 'tip'
        layers{end}.stiffness.tip = with_numbers(struct('name', w{2}), w(3:end));
      case 'knot'
        tip = layers{end}.stiffness.tip;
        if ~isfield(tip, 'radii')
          [tip.radii, tip.heights] = deal([]);
        end
        tip.radii(end + 1) = number(w{2});
        tip.heights(end + 1) = number(w{3});
        layers{end}.stiffness.tip = tip;
      otherwise
        if isnan(handle)
          try
            handle = nf_insertion('create', layers, settings);
          catch refused
            fprintf(stderr, '%s\n', refused.message);
            printf('refused\n');
            return
          end
        end
        switch what
          case 'at'
            ticks = number(w{2});
          case 'go'
            travels = cellfun(@number, w(5:end));
            n = number(w{2});
            all = ticks + cumsum(travels(mod(0:n - 1, numel(travels)) + 1));
            ticks = all(end);
            show(nf_insertion('run', handle, all * 2 ^ -30, number(w{3}), velocity(w{4})));
          case 'step'
            show(nf_insertion('step', handle, number(w{2}), number(w{4}), velocity(w{3})));
          case 'reset'
            nf_insertion('reset', handle);
          case 'keep'
            kept = nf_insertion('snapshot', handle);
          case 'restore'
            say(nf_insertion('restore', handle, kept));
          case 'alter'
            altered = kept;
            altered(number(w{2}) + 1) = bitxor(altered(number(w{2}) + 1), uint8(1));
            say(nf_insertion('restore', handle, altered));
        end
    end
  end
  nf_insertion('delete', handle);
end
cellfun(@trace_case, argv());
