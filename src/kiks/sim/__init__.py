"""The simulation: one object that joins arena, engine, firmware and clock."""
