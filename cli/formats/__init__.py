"""Other programs in and out: each file here is one format, or what the formats share."""
