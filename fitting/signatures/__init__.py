"""Signatures of effects in the features: how a trial would look if the robot or the camera had the effect."""

from fitting.signatures.affected_session import AffectedSession, view_of
from fitting.signatures.session_row import Whitened
from fitting.signatures.signature import Signature, signature_of

__all__ = ["AffectedSession", "Signature", "Whitened", "signature_of", "view_of"]
