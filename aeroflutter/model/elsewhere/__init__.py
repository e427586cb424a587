"""Models from elsewhere: state spaces and modal models, from arrays or from files.

- :mod:`~aeroflutter.model.elsewhere.rational`: rational approximations of tabulated aerodynamics;
- :mod:`~aeroflutter.model.elsewhere.modal`: modes and their aerodynamics as a family;
- :mod:`~aeroflutter.model.elsewhere.polynomial`: families that are polynomials of the speed;
- :mod:`~aeroflutter.model.elsewhere.tracked`: state spaces whose states differ from speed to speed;
- :mod:`~aeroflutter.model.elsewhere.placed`: some outputs with springs, the others linear;
- :mod:`~aeroflutter.model.elsewhere.variables`, :mod:`~aeroflutter.model.elsewhere.op4`: files.
"""
