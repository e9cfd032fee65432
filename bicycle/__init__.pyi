from bicycle.critical.critical_speeds import critical_speeds as critical_speeds
from bicycle.effect import Effect as Effect
from bicycle.effect import Mode as Mode
from bicycle.effect import Parameter as Parameter
from bicycle.effect import effect_class as effect_class
from bicycle.effect import load_effects as load_effects
from bicycle.effect import registry as registry
from bicycle.files.bicycle_file import available_bicycles as available_bicycles
from bicycle.files.bicycle_file import load_bicycle as load_bicycle
from bicycle.files.model_file import read_model as read_model
from bicycle.linear_model import LinearModel as LinearModel
from bicycle.modal.named_modes import modes as modes
from bicycle.model import Model as Model
from bicycle.model_family import ModelFamily as ModelFamily
from bicycle.parameters import Bicycle as Bicycle
from bicycle.responses.linear import respond as respond

LATER: dict[str, str]
