"""Tells catkin_python_setup where the module is; not to be run by hand."""
from distutils.core import setup

from catkin_pkg.python_setup import generate_distutils_setup

setup(**generate_distutils_setup(packages=["vcharge", "vcharge_page"], package_dir={"": "python"}, package_data={"vcharge_page": ["viewer/*"]}))
