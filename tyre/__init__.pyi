from tyre.ground.errors import InputError as InputError
from tyre.maps.find_tyre import read_tyre as read_tyre
from tyre.maps.map_files import available_tyres as available_tyres
from tyre.maps.tyre_map import TyreMap as TyreMap
from tyre.measured.properties import TyreProperties as TyreProperties
from tyre.measured.properties import TyreSource as TyreSource
from tyre.measured.tables import MeasuredTable as MeasuredTable

HOME: dict[str, str]
