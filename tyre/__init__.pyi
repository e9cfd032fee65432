from tyre.errors import InputError as InputError
from tyre.find_tyre import read_tyre as read_tyre
from tyre.map_files import available_tyres as available_tyres
from tyre.properties import TyreProperties as TyreProperties
from tyre.properties import TyreSource as TyreSource
from tyre.tables import MeasuredTable as MeasuredTable
from tyre.tyre_map import TyreMap as TyreMap

HOME: dict[str, str]
