"""Programs to begin with: plain pyserial, for a real Khepera as well."""
