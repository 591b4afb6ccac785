"""Gives the memory of code back that has done its work.

A module that is forgotten is loaded anew by the next import.
"""

import sys


def forget(*prefixes):
    """Forgets the modules whose names begin so; what something else holds goes on.

    Returns them.
    """
    found = []
    for name in list(sys.modules):
        if name.startswith(prefixes):
            found.append(sys.modules[name])
            # A dictionary keeps the value of a key that is deleted until the place is used again.
            sys.modules[name] = None
            del sys.modules[name]
            package, _, last = name.rpartition(".")
            remove(sys.modules.get(package), last)
    return found


def erase(*prefixes):
    """Forgets modules and empties them: those of which nothing is needed any more.

    The garbage collector takes whatever looks like an address for one. An old one on the stack
    would keep a module, and with it all that this has imported.
    """
    for module in forget(*prefixes):
        module.__dict__.clear()


def remove(owner, *names):
    """Removes attributes of a module or a class, of those that it has."""
    for name in names:
        if hasattr(owner, name):
            setattr(owner, name, None)
            delattr(owner, name)
