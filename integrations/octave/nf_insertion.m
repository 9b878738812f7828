% NF_INSERTION  The force of a needle in soft tissue, a step or a whole motion at a time.
%
%   h = nf_insertion('create', layers)            an insertion, before the first contact; h is its number
%   h = nf_insertion('create', layers, settings)
%   s = nf_insertion('run', h, depth, dt)         a step for each depth [m]; dt [s] is one number, or one for each
%   s = nf_insertion('run', h, depth, dt, velocity)   [m/s]; left out or []: the change of depth
%   s = nf_insertion('step', h, depth, dt)        one step, with velocity as above
%   nf_insertion('reset', h)                      back to before the first contact
%   bytes = nf_insertion('snapshot', h)           its memory; ok = nf_insertion('restore', h, bytes) takes it back,
%                                                 or is false and changes nothing
%   nf_insertion('delete', h)                     frees it; `clear all` frees every one
%
% SI units: depth + inwards from the undeformed surface, force + when it opposes insertion.
%
% layers: a struct array from the surface down, as nf_model gives it. Each has top [m] and the laws stiffness,
% puncture, friction, cutting and relaxation: structs with a name and parameters, defaults for those left out.
% `needleforce laws` lists them.
%
%   layer.top = 0;
%   layer.stiffness = struct('name', 'cone', 'reduced_modulus', 116e3, 'half_angle', 0.26);
%   layer.puncture = struct('name', 'puncture_depth', 'depth', 3.2e-3);
%   layer.friction = struct('name', 'coulomb', 'per_length', 18.6);
%   layer.cutting = struct('name', 'constant_cutting', 'force', 0.0776);
%   h = nf_insertion('create', layer);
%   s = nf_insertion('run', h, linspace(0, 8e-3, 4000), 1e-3);
%   plot(1e3 * s.depth, s.force)
%
% settings: max_speed, hold_time, velocity_slack, velocity_slack_ratio, bevel_half_angle,
% bevel_friction_coefficient, bevel_face_share, depth_noise, as fields.
%
% s: columns depth, velocity, force, stiffness, friction, cutting, lateral, force_by_depth, force_by_velocity,
% phase (0 free, 1 deformation, 2 insertion, 3 hold, 4 extraction), status (0 ok, 1 outside range,
% 2 invalid parameter, 3 not finite: the force is zero, or held for hold_time), contact, punctured, exit.
%
% See also nf_model, nf_identify, nf_build.

% SPDX-License-Identifier: Apache-2.0
function varargout = nf_insertion(what, varargin)
  if exist('nf_insertion_mex', 'file') ~= 3
    error('needleforce:library', ['nf_insertion_mex is not compiled: nf_build(''PREFIX''), where `cmake --install ' ...
          'build --prefix PREFIX` put the C library.']);
  end
  if nargin > 0 && strcmp(what, 'step')
    if numel(varargin) > 1 && numel(varargin{2}) ~= 1
      error('needleforce:input', 'a step has one depth, not %d: nf_insertion(''run'', ...) takes many.', ...
            numel(varargin{2}));
    end
    what = 'run';
  end
  if nargin == 0
    what = '';
  end
  [varargout{1:nargout}] = nf_insertion_mex(what, varargin{:});
end
