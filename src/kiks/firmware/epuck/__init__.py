"""The e-puck's firmware, the program "advanced sercom": ASCII lines and binary requests on one serial line."""
