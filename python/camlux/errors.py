"""The exceptions of camlux. Each derives from camlux.Error, and from the built-in exception that Python raises in such a case."""

import errno


class Error(Exception):
    """The base class of all camlux errors. The message says what is wrong, where, and how to mend it."""


class SceneError(Error, ValueError):
    """A scene, or a file that it names, cannot be used."""


class FieldError(Error, AttributeError):
    """A class of a scene has no field of this name."""


class ArgumentError(Error, ValueError):
    """An argument of a function has a value that cannot be used."""


class SceneTypeError(SceneError, TypeError):
    """A part of a scene is of a type that it cannot have, such as a class instead of an object of it."""


class ArgumentTypeError(ArgumentError, TypeError):
    """An argument is of a type that it cannot have, or there is no argument of its name."""


class UnsupportedError(Error, TypeError):
    """An object cannot be copied or pickled, or an operation is not defined for its class."""


class LayerError(Error, KeyError):
    """A frame, or an image file, has no layer of this name."""

    def __str__(self) -> str:
        # KeyError shows its argument by repr.
        return str(self.args[0]) if self.args else ""


class DeviceError(Error, RuntimeError):
    """There is no such device, its memory or a limit is too small, a Vulkan call failed, or the process was forked."""


class DeviceLostError(DeviceError):
    """The driver lost the device: open it again."""


class FileError(Error, OSError):
    """An image cannot be read or compared, or a file cannot be written."""


class MissingFileError(FileError, FileNotFoundError):
    """A file, or the folder to write it to, does not exist."""

    def __init__(self, *arguments: object) -> None:
        super().__init__(*arguments)
        self.errno = errno.ENOENT


class MissingSceneFileError(SceneError, MissingFileError):
    """A scene file, or a file that it names, does not exist."""


class Cancelled(Error):
    """The progress callback returned False."""


class CamluxWarning(UserWarning):
    """A probable mistake that does not prevent rendering."""
