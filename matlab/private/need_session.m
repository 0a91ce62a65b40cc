function need_session(name)
% need_session  Stop with a message if there is no session.

if ~is_active()
    error('kiks:session', '%s needs a session, but there is none. Start one with kiks, or with kiks(ARENA).', name);
end
end
