function need_ref(ref)
% need_ref  Stop with a message if a value is not the reference of an open port.

if ~isnumeric(ref) || numel(ref) < 4
    error('kiks:argument', ['A command needs a reference of 4 elements, as kiks_kopen returns it, but it was %s. ' ...
        'Call ref = kiks_kopen([-1 9600 1]) first.'], shown(ref));
end
end
