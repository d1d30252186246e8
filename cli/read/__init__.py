"""What a user gives, turned into SI numbers: tables, units, option values, planes, parts."""
