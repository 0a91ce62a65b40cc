function warn(identifier, varargin)
% warn  Warn without a backtrace through the functions of the toolbox.

before = warning('query', 'backtrace');
warning('off', 'backtrace');
back = onCleanup(@() warning(before.state, 'backtrace')); %#ok<NASGU>
warning(identifier, varargin{:});
end
