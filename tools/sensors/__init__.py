"""The accuracy card of the proximity sensors, and the models that stand on it."""
