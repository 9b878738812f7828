% NF_BUILD  Compiles the gateway of nf_insertion, once.
%
%   nf_build('PREFIX')   with the C library below PREFIX, where `cmake --install build --prefix PREFIX` put it
%
% It needs a C compiler: in Debian `sudo apt-get install octave-dev`, in MATLAB one that `mex -setup` finds.

% SPDX-License-Identifier: Apache-2.0
function nf_build(prefix)
  if ~exist(fullfile(prefix, 'include', 'needleforce.h'), 'file')
    error('needleforce:library', ['%s has no include/needleforce.h: give the folder where `cmake --install build ' ...
          '--prefix PREFIX` put the C library.'], prefix);
  end
  here = fileparts(mfilename('fullpath'));
  found = arrayfun(@(each) ['-L' fullfile(prefix, each{1})], {'lib', 'lib64'}, 'UniformOutput', false);
  from = pwd();
  back = onCleanup(@() cd(from));
  cd(here);
  mex(['-I' fullfile(prefix, 'include')], 'nf_insertion_mex.c', found{:}, '-lneedleforce');
end
