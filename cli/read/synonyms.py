"""What the quantities of a table are called in English, German, Portuguese, Spanish and French: for hints alone."""

from __future__ import annotations

import re
from collections.abc import Iterable

_WORDS = {
    "mass": "mass masse massa masa gewicht",
    "weight": "weight gewichtskraft gewicht peso poids force_poids",
    "radius": "radius radii halbmesser raio radio rayon r",
    "diameter": "diameter durchmesser diametro diametre",
    "angle": "angle winkel winkellage angulo ang theta position_angulaire winkelposition",
    "z": "z axial axial_position abstand lage posicao_axial posicion_axial position_axiale cote distance ebenenlage",
    "unbalance": "unbalance imbalance unwucht desbalanceamento desbalanco desequilibrio balourd",
    "plane": "plane ebene ausgleichsebene plano plano_de_correcao plano_de_correccion plan plan_de_correction",
    "rotor": "rotor machine maschine laeufer maquina",
    "name": "name bezeichnung benennung nome nombre nom teil",
    "run": "run lauf messlauf messung corrida rodada medicao marcha medicion ensayo essai mesure lancement",
    "sensor": "sensor aufnehmer messstelle messpunkt messebene transdutor captador sonda capteur point_de_mesure",
    "speed": "speed drehzahl velocidade rotacao velocidad velocidad_de_giro vitesse vitesse_de_rotation n rpm",
    "amplitude": "amplitude schwingung vibration vibracao vibracion amplitud valor wert",
    "phase": "phase phasenlage phasenwinkel fase fase_angular angle_de_phase",
    "trial_mass": "trial_mass trial_weight testmasse probemasse probegewicht testgewicht massa_de_teste massa_de_prova "
    "massa_tentativa masa_de_prueba peso_de_prueba masse_d_essai masse_test",
    "trial_angle": "trial_angle testwinkel probewinkel angulo_de_teste angulo_da_massa angulo_de_prueba angle_d_essai",
    "trial_plane": "trial_plane testebene probeebene plano_de_teste plano_de_prueba plan_d_essai plane ebene plano plan",
    "part": "part teil bauteil peca pieza piece",
    "shape": "shape form koerper forma forme",
    "link": "link glied elo barra eslabon membre biela",
    "step": "step schritt passo paso pas",
    "inertia": "inertia traegheitsmoment massentraegheitsmoment inercia momento_de_inercia inertie moment_d_inertie",
    "torque": "torque moment drehmoment torque momento par couple",
    "length": "length laenge comprimento longitud longueur",
    "width": "width breite largura ancho anchura largeur",
    "height": "height hoehe altura hauteur",
    "density": "density dichte densidade densidad densite",
    "time": "time zeit tempo tiempo temps t",
}
"""Quantity -> its names, without accents; among several quantities the first that a command knows is meant."""


def _plain(word: str) -> str:
    """Return a word in small letters, without accents, one `_` between its parts."""
    word = word.casefold().replace("ä", "ae").replace("ö", "oe").replace("ü", "ue")
    if not word.isascii():
        import unicodedata

        word = "".join(c for c in unicodedata.normalize("NFKD", word) if not unicodedata.combining(c))
    return re.sub(r"[^a-z0-9]+", "_", word).strip("_")


def quantity_meant(word: str, known: Iterable[str]) -> str:
    """Return the known quantity that a foreign word may mean; nothing for one that is none.

    Examples
    --------
    >>> quantity_meant("Masse", ["mass", "radius"]), quantity_meant("ângulo", ["angle"])
    ('mass', 'angle')
    >>> quantity_meant("Bemerkung", ["mass", "radius"])
    ''
    """
    plain = _plain(word)
    return next((quantity for quantity in known if plain in _WORDS.get(quantity, "").split()), "")
