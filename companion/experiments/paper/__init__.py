"""The experiments, figures and claims of Pereida & Schoellig (IROS 2018), flown in lockstep.

Each experiment is a module: `tasks` says what is flown, `evaluate` makes figures of the flights.
`study` joins them, `claims` judges what the paper says, `figures` draws, `report` writes the page.
"""
