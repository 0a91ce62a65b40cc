"""Where pyserial looks for `protocol_kiks`: this package stands in its list of URL handlers once `kiks` is imported."""
