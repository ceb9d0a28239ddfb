"""System structure packages (.ssp) of SSP 1.0 and 2.0: written as other tools read them, read as any tool writes them.

package.py    the archive, and where its FMUs lie
xml.py        parsing and schemas; structure.py, values.py make model.py of it
wires.py      connections through systems within systems; flatten.py makes one flat system
own.py        what SSP has no place for; refine.py what of it still holds
read.py, write.py
"""
