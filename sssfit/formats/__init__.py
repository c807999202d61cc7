"""Files of other programs: MCML's, tables in CSV, pictures."""
