"""Name the packages: those under aeroflutter/, and generated/ as aeroflutter.generated."""

from setuptools import find_packages, setup

setup(
    packages=[
        *find_packages(include=["aeroflutter", "aeroflutter.*"]),
        "aeroflutter.generated",
        *(f"aeroflutter.generated.{name}" for name in find_packages("generated")),
    ]
)
