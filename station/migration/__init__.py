"""Brings what older versions recorded to the present version of the schemas, one explicit step a version."""
