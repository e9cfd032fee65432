from bicycle.bicycle_files import available_bicycles as available_bicycles
from bicycle.bicycle_files import load_bicycle as load_bicycle
from bicycle.critical import critical_speeds as critical_speeds
from bicycle.effect import Effect as Effect
from bicycle.effect import Mode as Mode
from bicycle.effect import Parameter as Parameter
from bicycle.effect_registry import effect_class as effect_class
from bicycle.effect_registry import load_effects as load_effects
from bicycle.effect_registry import registry as registry
from bicycle.linear_model import LinearModel as LinearModel
from bicycle.model import Model as Model
from bicycle.model_family import ModelFamily as ModelFamily
from bicycle.model_file import read_model as read_model
from bicycle.named_modes import modes as modes
from bicycle.parameters import Bicycle as Bicycle
from bicycle.responses import respond as respond

LATER: dict[str, str]
