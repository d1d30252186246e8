"""Files of other programs, whatever they describe: text, JSON, XML; their sizes, numbers and errors. No mechanics."""
