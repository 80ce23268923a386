"""What effects do to features: how a trial would look if the robot or the camera did what the plain twin leaves out."""

from fitting.signatures.affected_session import AffectedSession
from fitting.signatures.separation import Together, Whitened
from fitting.signatures.signature import Signature, signature_of
from fitting.signatures.view_of import view_of

__all__ = ["AffectedSession", "Signature", "Together", "Whitened", "signature_of", "view_of"]
