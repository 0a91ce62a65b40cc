"""A room: a desk for each student of a class, behind one address, and the lecturer's page."""
