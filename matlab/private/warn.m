function warn(identifier, varargin)
% warn  Warn without telling through which functions of the toolbox the warning came.

before = warning('query', 'backtrace');
warning('off', 'backtrace');
back = onCleanup(@() warning(before.state, 'backtrace')); %#ok<NASGU>
warning(identifier, varargin{:});
end
