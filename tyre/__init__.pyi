from tyre.base.errors import InputError as InputError
from tyre.find_tyre import read_tyre as read_tyre
from tyre.maps.find_table import available_tyres as available_tyres
from tyre.maps.tables import MeasuredTable as MeasuredTable
from tyre.maps.tyre_map import TyreMap as TyreMap
from tyre.properties import TyreProperties as TyreProperties
from tyre.tyre_source import TyreSource as TyreSource

HOME: dict[str, str]
