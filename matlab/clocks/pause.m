function varargout = pause(varargin)
% pause  Wait in the program's time, see kiks_clock; without a number, as ever, for a key.

if nargin == 1 && isnumeric(varargin{1}) && isscalar(varargin{1}) && isfinite(varargin{1}) && varargin{1} >= 0
    if isequal(kiks_clock('rest', double(varargin{1})), 0)
        drawnow();
        return
    end
end
[varargout{1:nargout}] = builtin('pause', varargin{:});
end
