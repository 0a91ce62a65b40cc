function known = calibration()
% calibration  The results of kiks_calibrate: the variables of kiks_data.mat in the current folder.
%
%   known = calibration() is a struct; without the file there is no latency and KIKS_COMPUTER_SPEED is empty.

known = struct('KIKS_KSEND_CONSTANT', 0, 'KIKS_CALIBRATE_BAUD', 9600, 'KIKS_KSEND_VARIATION', 0, ...
    'KIKS_COMPUTER_SPEED', []);
file = fullfile(pwd(), 'kiks_data.mat');
if exist(file, 'file') ~= 2
    return
end
found = load(file);
names = fieldnames(known);
for k = 1:numel(names)
    name = names{k};
    if isfield(found, name)
        value = found.(name);
        if ~isnumeric(value) || ~isscalar(value) || ~isfinite(value)
            error('kiks:argument', ['%s in %s must be a finite number, but it was %s. ' ...
                'Delete the file, or call kiks_calibrate anew.'], name, file, shown(value));
        end
        known.(name) = value;
    end
end
if known.KIKS_CALIBRATE_BAUD <= 0
    error('kiks:argument', ['KIKS_CALIBRATE_BAUD in %s must be larger than 0, but it was %g. ' ...
        'Call kiks_calibrate anew.'], file, known.KIKS_CALIBRATE_BAUD);
end
if known.KIKS_COMPUTER_SPEED <= 0
    known.KIKS_COMPUTER_SPEED = [];
end
end
