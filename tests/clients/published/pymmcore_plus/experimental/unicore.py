"""What pymmcore-plus publishes of its Python devices, as far as tests/clients/micromanager_test.py asks for it: the names, the
abstract methods and how its core calls them, written from its documentation (pymmcore_plus.experimental.unicore, 2025). It stands
in for the package where no Python packages can be had."""
import abc
import threading


class Property:
    def __init__(self, value, getter, setter, allowed, read_only):
        self.value, self.getter, self.setter, self.allowed, self.read_only = value, getter, setter, allowed, read_only


class Device(abc.ABC):
    """A core holds the lock of a device while it calls it, but for stop() and home()."""

    def __init__(self):
        super().__init__()
        self._lock = threading.Lock()
        self._properties = {}

    def __enter__(self):
        self._lock.acquire()
        return self

    def __exit__(self, *unused):
        self._lock.release()

    def register_property(self, name, *, default_value=None, getter=None, setter=None, limits=None, sequence_max_length=0,
                          allowed_values=None, is_read_only=False, is_pre_init=False, property_type=None, sequence_loader=None,
                          sequence_starter=None, sequence_stopper=None):
        self._properties[name] = Property(default_value, getter, setter, allowed_values, is_read_only or (getter and not setter))

    def get_property_value(self, prop_name):
        found = self._properties[prop_name]
        return found.getter(self) if found.getter else found.value

    def set_property_value(self, prop_name, value):
        found = self._properties[prop_name]
        if found.read_only:
            raise ValueError(f"Property {prop_name!r} is read-only.")
        if found.allowed and value not in found.allowed:
            raise ValueError(f"Value {value!r} is not allowed.")
        if found.setter:
            found.setter(self, value)
        else:
            found.value = value

    def busy(self):
        return False


class StageDevice(Device):
    @abc.abstractmethod
    def home(self):
        ...

    @abc.abstractmethod
    def stop(self):
        ...

    @abc.abstractmethod
    def set_origin(self):
        ...

    @abc.abstractmethod
    def set_position_um(self, val):
        ...

    @abc.abstractmethod
    def get_position_um(self):
        ...

    def set_relative_position_um(self, d):
        self.set_position_um(self.get_position_um() + d)

    def set_adapter_origin_um(self, newZUm):
        ...
