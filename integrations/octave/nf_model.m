% NF_MODEL  The layers of a model, for nf_insertion.
%
%   layers = nf_model('paper')      a preset, a preset file, or the JSON file of a fit
%
% It asks the command `needleforce`, or that which the environment variable NEEDLEFORCE names.
%
% See also nf_insertion, nf_identify.

% SPDX-License-Identifier: Apache-2.0
function layers = nf_model(name)
  layers = jsondecode(nf_command('export', name, '--language', 'json'));
end
