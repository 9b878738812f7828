# SPDX-License-Identifier: Apache-2.0
"""How values show themselves: text, HTML tables and labelled axes."""
