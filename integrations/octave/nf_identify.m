% NF_IDENTIFY  Parameters of a force model from recordings, with intervals.
%
%   fit = nf_identify('run1.csv', 'needle', 'paper')
%   fit = nf_identify({'run1.csv', 'run2.csv'}, 'needle', 'needle.toml', 'model', 'cone_cylinder')
%
% Options are those of `needleforce identify`, without the dashes. The result is what its --json writes:
% fit.parameters, each with value, low, high, unit and identifiable, fit.quality, fit.warnings and more; and fit.layers
% for nf_insertion, [] for a fit without a model.
%
% It asks the command `needleforce`, or that which the environment variable NEEDLEFORCE names.
%
% See also nf_insertion, nf_model.

% SPDX-License-Identifier: Apache-2.0
function fit = nf_identify(files, varargin)
  if ischar(files)
    files = {files};
  end
  options = varargin;
  for i = 1:2:numel(options)
    options{i} = ['--' strrep(options{i}, '_', '-')];
    if i < numel(options) && isnumeric(options{i + 1})
      options{i + 1} = sprintf('%.17g', options{i + 1});
    end
  end
  json = [tempname() '.json'];
  gone = onCleanup(@() delete(json));
  nf_command('identify', files{:}, options{:}, '--json', json);
  fit = jsondecode(fileread(json));
  fit.layers = [];
  if isstruct(fit.preset)
    fit.layers = nf_model(json);
  end
end
