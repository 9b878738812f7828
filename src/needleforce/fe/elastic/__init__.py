# SPDX-License-Identifier: Apache-2.0
"""Linear tissue: elements, supports, solution, and what it condenses to along a needle."""
