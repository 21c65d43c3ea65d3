"""What a repair kept and lost, as a text and as a document for programs."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from disc_sim_ros.bags.contents import Loss
from disc_sim_ros.errors import printable


@dataclass(frozen=True, slots=True)
class RepairReport:
    """What a repair kept and lost.

    Attributes:
        source: The bag that was read.
        target: The bag that was made.
        was_whole: Nothing was damaged or missing in the source.
        kept: Messages by topic.
        attachments: How many were kept.
        losses: What is damaged or missing.
        unknown: What may have been lost without a trace.
        mended: What was put right, a line for each file and fault.
    """

    source: Path
    target: Path
    was_whole: bool
    kept: dict[str, int]
    attachments: int
    losses: tuple[Loss, ...]
    unknown: tuple[str, ...] = ()
    mended: tuple[str, ...] = ()

    @property
    def message_count(self) -> int:
        """Messages kept, of all topics."""
        return sum(self.kept.values())

    @property
    def bytes_lost(self) -> int:
        """Bytes of the source that cannot be read."""
        return sum(loss.length for loss in self.losses)

    def document(self) -> dict[str, Any]:
        """Return the report for programs."""
        return {
            'source': str(self.source),
            'target': str(self.target),
            'was_whole': self.was_whole,
            'message_count': self.message_count,
            'kept': self.kept,
            'attachments': self.attachments,
            'bytes_lost': self.bytes_lost,
            'losses': [
                {
                    'file': str(loss.path),
                    'offset': loss.offset,
                    'length': loss.length,
                    'messages': loss.messages,
                    'reason': loss.reason,
                }
                for loss in self.losses
            ],
            'unknown': list(self.unknown),
            'mended': list(self.mended),
        }

    def summary(self) -> str:
        """Return the report to read."""
        names = {name: printable(name) for name in self.kept}
        width = max(map(len, names.values()), default=0)
        lines = [f'{self.source} -> {self.target}']
        lines += [
            f'  {names[name]:{width}}  {_count(count, "message")}'
            for name, count in self.kept.items()
        ]
        lines.append(
            f'  kept  {_count(self.message_count, "message")} of '
            f'{_count(len(self.kept), "topic")}, {_count(self.attachments, "attachment")}'
        )
        if self.losses:
            known = sum(loss.messages or 0 for loss in self.losses)
            amounts = [_count(self.bytes_lost, 'byte')] * bool(self.bytes_lost)
            amounts += [f'{_count(known, "message")} that are known of'] * bool(known)
            lines.append(f'  lost  {", ".join(amounts) or "an unknown amount"}')
            lines += [f'    {printable(str(loss))}' for loss in self.losses]
        elif self.was_whole:
            lines.append('  the bag was whole')
        else:
            lines.append('  lost  nothing of what is there' if self.unknown else '  lost  nothing')
            if not self.mended:
                lines.append('  mended: metadata.yaml was missing, or not that of these files')
        lines += [f'  not known: {printable(text)}' for text in self.unknown]
        lines += [f'  mended: {printable(text)}' for text in self.mended]
        return '\n'.join(lines)


def _count(number: int, thing: str) -> str:
    return f'{number} {thing}{"" if number == 1 else "s"}'
