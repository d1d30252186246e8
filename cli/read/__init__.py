"""What a user types, turned into numbers: options, planes and grades, the search for a number that is to be found."""
