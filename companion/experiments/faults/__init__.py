"""The table of faults: flights that are hurt on purpose, and what each row of it promises.

`table` reads the rows, `flying` flies one, `reading` makes evidence of what was recorded, `judging`
compares it with what is promised, `endings` says how it ended; `study` does it for all, `written`
and `page` tell.
"""
