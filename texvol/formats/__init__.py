"""Files: volumes in (`readers`), pictures in and out (`pictures`), films out (`films`)."""
