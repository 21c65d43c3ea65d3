"""Estimation: from measured flights to a disc (identification) and to a landing (prediction)."""
