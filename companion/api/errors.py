"""What the library raises."""


class InputError(ValueError):
    """What was asked for can't be done as asked; the text names what, where and the remedy.

    Nothing was flown.
    """


class ControllerError(RuntimeError):
    """A controller of one's own raised an exception in flight, and nothing stood by.

    The exception is its cause (``__cause__``), with its traceback.
    """
