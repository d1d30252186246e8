"""A result is tables of quantities: CSV, JSON, text, workbook, report, `--expect` and `--digits` all walk them."""
