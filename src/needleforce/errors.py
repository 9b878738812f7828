# SPDX-License-Identifier: Apache-2.0
"""The error for input that a user can correct: quantity, value, limit, place and next step."""


class InputError(ValueError):
    """An input is missing, out of range, inconsistent or not readable.

    The message joins the parts in this order: ``place: quantity is value, limit. next step``. Empty parts are left out.

    Parameters
    ----------
    quantity : str
        What is wrong, such as ``"unit of depth"``.
    value : object
        The value found.
    limit : str
        The limit that the value violates, or what is needed.
    place : str
        Where: a file with its line, a key path, or a function.
    next_step : str
        What to do, as a sentence.
    """

    exit_code = 2  # of a command that ends with this error

    def __init__(self, quantity: str, value: object = "", limit: str = "", place: str = "", next_step: str = ""):
        self.quantity, self.value, self.limit = quantity, value, limit
        self.place, self.next_step = place, next_step
        super().__init__(self._message())

    def _message(self) -> str:
        problem = f"{self.quantity} is {self.value}" if self.value != "" else self.quantity
        problem += f", {self.limit}" if self.limit else ""
        prefix = f"{self.place}: " if self.place else ""
        return f"{prefix}{problem}." + (f" {self.next_step}" if self.next_step else "")

    def at(self, place: str) -> "InputError":
        """Return a copy of the error with an outer place added.

        Parameters
        ----------
        place : str
            Written before the place that the error already has.

        Returns
        -------
        InputError
            The new error.
        """
        inner = f"{place}: {self.place}" if self.place else place
        return InputError(self.quantity, self.value, self.limit, inner, self.next_step)
