# SPDX-License-Identifier: Apache-2.0
"""The one error a user can mend: what was wrong, how far, where, and what to do."""


class InputError(ValueError):
    """A quantity, its value, the limit it broke, the place, and the next step.

    Every part is plain text and may be empty; the message is the parts joined, in that order.
    """

    def __init__(self, quantity: str, value: object = "", limit: str = "", place: str = "", next_step: str = ""):
        self.quantity, self.value, self.limit = quantity, value, limit
        self.place, self.next_step = place, next_step
        super().__init__(self._message())

    def _message(self) -> str:
        said = f"{self.quantity} is {self.value}" if self.value != "" else self.quantity
        said += f", {self.limit}" if self.limit else ""
        where = f"{self.place}: " if self.place else ""
        return f"{where}{said}." + (f" {self.next_step}" if self.next_step else "")

    def at(self, place: str) -> "InputError":
        """The same error, told from the outside: ``place`` goes before the place it has."""
        inner = f"{place}: {self.place}" if self.place else place
        return InputError(self.quantity, self.value, self.limit, inner, self.next_step)
