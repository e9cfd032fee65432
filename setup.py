"""What pyproject.toml cannot say: a wheel is tagged as a binary only where the kernel in C could be compiled."""

from pathlib import Path

from setuptools import setup
from setuptools.command.bdist_wheel import bdist_wheel


class KernelOrPlainWheel(bdist_wheel):
    """A wheel for one platform with the kernel, or for every one without."""

    def run(self) -> None:
        self.run_command("build_ext")
        if not all(Path(file).exists() for file in self.get_finalized_command("build_ext").get_outputs()):
            self.distribution.ext_modules = []
            self.root_is_pure = True
        super().run()


setup(cmdclass={"bdist_wheel": KernelOrPlainWheel})
