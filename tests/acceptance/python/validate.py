"""Prints the list of problems that fmpy finds in an FMU: validate.py FMU"""
import sys

from fmpy.validation import validate_fmu

print(validate_fmu(sys.argv[1]))
