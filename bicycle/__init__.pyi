from bicycle.effects.effect import Effect as Effect
from bicycle.effects.effect import Mode as Mode
from bicycle.effects.effect import Parameter as Parameter
from bicycle.effects.effect_registry import effect_class as effect_class
from bicycle.effects.effect_registry import load_effects as load_effects
from bicycle.effects.effect_registry import registry as registry
from bicycle.files.bicycle_files import available_bicycles as available_bicycles
from bicycle.files.bicycle_files import load_bicycle as load_bicycle
from bicycle.model.model import Model as Model
from bicycle.model.model_family import ModelFamily as ModelFamily
from bicycle.model.model_file import read_model as read_model
from bicycle.model.state_space import LinearModel as LinearModel
from bicycle.motion.responses import respond as respond
from bicycle.parameters.bicycle import Bicycle as Bicycle
from bicycle.stability.critical import critical_speeds as critical_speeds
from bicycle.stability.named_modes import modes as modes

LATER: dict[str, str]
