% NF_COMMAND  Runs the command `needleforce` with some arguments and gives what it prints.
%
%   text = nf_command('laws')
%
% The environment variable NEEDLEFORCE names another command, such as the path of one in a virtual environment.

% SPDX-License-Identifier: Apache-2.0
function text = nf_command(varargin)
  program = getenv('NEEDLEFORCE');
  if isempty(program)
    program = 'needleforce';
  end
  errors = [tempname() '.txt'];
  gone = onCleanup(@() delete(errors));
  words = cellfun(@quoted, [{program}, varargin], 'UniformOutput', false);
  [status, text] = system([strjoin(words, ' ') ' 2> ' quoted(errors)]);
  if status ~= 0
    message = strtrim(fileread(errors));
    if any(status == [126 127 9009])
      message = sprintf(['the command %s was not found: `pip install needleforce`, or ' ...
                         'setenv(''NEEDLEFORCE'', ''PATH'') with its path.'], program);
    end
    error('needleforce:command', '%s', message);
  end
end

function word = quoted(word)
  if ispc()
    word = ['"' strrep(word, '"', '""') '"'];
  else
    word = ['''' strrep(word, '''', '''\''''') ''''];
  end
end
