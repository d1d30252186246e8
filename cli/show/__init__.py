"""What a user receives: tables of columns as text, CSV and JSON, digits that hold, expectations, pictures, files."""
