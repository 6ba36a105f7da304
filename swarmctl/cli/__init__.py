"""The command line: one module per verb. A verb parses arguments, calls other packages and prints."""
