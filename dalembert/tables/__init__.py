"""Tables from files: CSV as spreadsheets write it, and workbooks; delimiters, decimal commas, headers with units."""
