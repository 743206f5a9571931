"""Studies: one file asks a question of many runs, and answers it with a table and charts."""
