"""Works of the library that many commands ask for with the same arguments, done once each."""

import functools
import pickle
import warnings


def once(real, *, aside=frozenset()):
    """The function, that hands on what it returned, and repeats its warnings, for equal arguments.

    Every caller gets a copy of its own. Arguments named in ``aside`` make no difference to what is
    returned; calls with what cannot be pickled, and those that raise, are not remembered.
    """
    known = {}

    @functools.wraps(real)
    def call(*arguments, **keywords):
        counted = {name: each for name, each in keywords.items() if name not in aside}
        try:
            key = pickle.dumps((arguments, sorted(counted.items())))
        except (pickle.PicklingError, TypeError, AttributeError):
            return real(*arguments, **keywords)
        if key not in known:
            with warnings.catch_warnings(record=True) as said:
                warnings.simplefilter("always")
                made = real(*arguments, **keywords)
            known[key] = pickle.dumps(made), [each.message for each in said]
        made, said = known[key]
        for message in said:
            warnings.warn(message, stacklevel=2)
        return pickle.loads(made)

    return call
