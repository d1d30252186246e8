"""Which forces are asked for, and where they go: nothing of them is loaded where none is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cli.mechanism.solve import Job


@dataclass
class Asked:
    """What the options --forces, --equilibrium, --flywheel and --counterweights ask for."""

    forces: bool
    equilibrium: bool
    flywheel: float | None
    counterweights: str | None
    swept: bool
    said: tuple[str, ...] = ()

    def table(self, job: Job) -> dict[str, list[Any]]:
        """The force table: one row per pose."""
        from cli.mechanism import forces

        return forces.table(job)

    def document(self, job: Job) -> dict[str, Any]:
        """What the JSON holds beside the poses."""
        extra: dict[str, Any] = {}
        if not (self.forces or self.equilibrium or self.flywheel is not None or self.counterweights):
            return extra
        from cli.mechanism import forces

        of_one = self.forces and len(job.mechanism.inputs) == 1
        if (of_one or self.flywheel is not None) and self.swept:
            extra["cycle"] = forces.cycle(job, self.flywheel)
        if self.equilibrium:
            extra["equilibria"], said = forces.equilibria(job, self.swept)
            self.said = (*self.said, *said)
        if self.counterweights:
            links = [name.strip() for name in self.counterweights.split(",") if name.strip()]
            extra["counterweights"] = forces.counterweights(job, links)
        return extra

    def with_forces(self, job: Job, poses: list[dict[str, Any]]) -> list[dict[str, Any]]:
        """The JSON's poses with effort, reactions and shaking force."""
        if not self.forces:
            return poses
        from cli.mechanism import forces

        return [pose | part for pose, part in zip(poses, forces.poses(job), strict=True)]

    def warnings(self, job: Job) -> list[str]:
        """What the forces cannot say."""
        if not self.forces:
            return list(self.said)
        from cli.mechanism import forces

        return [*self.said, *forces.warnings(job)]

    def text(self, extra: dict[str, Any]) -> list[str]:
        """Paragraphs below the terminal's table."""
        if not extra:
            return []
        from cli.mechanism import forces

        shown = []
        if "cycle" in extra:
            shown.append(forces.cycle_text(extra["cycle"]))
        if "equilibria" in extra:
            shown.append(forces.equilibria_text(extra["equilibria"]))
        if "counterweights" in extra:
            shown.append(forces.counterweights_text(extra["counterweights"]))
        return shown

    def explain(self, job: Job) -> list[str]:
        """What was evaluated for the forces and what was left out."""
        if not self.forces:
            return []
        from cli.mechanism import forces

        forces.poses(job)
        return [forces.explain_text(job)]

    def figure(self, job: Job) -> Figure:
        """Effort, joint forces and the hodograph of the shaking force over the sweep."""
        from cli.mechanism.force_picture import draw

        return draw(job)
