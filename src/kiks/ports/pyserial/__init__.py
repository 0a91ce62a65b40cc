"""The package of `protocol_kiks`; importing `kiks` adds it to pyserial's list of URL handlers."""
