"""The firmware of the Khepera and the Khepera II: the commands, tools and hints of K-Team's serial protocol."""
