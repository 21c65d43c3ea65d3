"""The part of the writer that owns the files: one is open, and metadata.yaml is beside them."""

from pathlib import Path

from disc_sim_ros import files
from disc_sim_ros.bags import metadata
from disc_sim_ros.bags.mcap_writer import McapFile
from disc_sim_ros.bags.metadata_builder import MetadataBuilder

_MARGIN = 64 * 1024  # bytes of room kept for the end beside what is counted


class BagFiles:
    """The files of a bag that is being written. Each method may raise OSError.

    Attributes:
        file: The open one.
        metadata: What metadata.yaml is made of. Set `stale` where it changes.
        stale: metadata.yaml is behind `metadata`.
        flushed: Messages that the disk has.
    """

    def __init__(self, folder: Path, compression: str, builder: MetadataBuilder) -> None:
        """Make the first file and metadata.yaml in a folder."""
        self.metadata = builder
        self.stale = True
        self.flushed = 0
        self._folder = folder
        self._compression = compression
        self._synced = 0  # bytes of the open file that the disk has
        self._text_size = 0  # bytes of the last metadata.yaml
        self._reserve = files.Reserve(folder)
        self.file = self._new_file(0)
        try:
            self._begin()
        except OSError:
            self.close()
            raise

    def end_chunk(self) -> None:
        """Write the open chunk."""
        self.hold_reserve()
        self.file.end_chunk()

    def flush(self) -> None:
        """Bring everything to the disk, messages and metadata.yaml."""
        self.end_chunk()
        if self.file.size > self._synced:
            self.file.sync()
            self._synced = self.file.size
            self.flushed = self.metadata.message_count(self.file)
            self.stale = True
        if self.stale:
            self._write_metadata()
            self.stale = False

    def open_next(self) -> None:
        """End the open file and make the next one."""
        self.end_chunk()
        self._finish()
        ended = self.file
        self.file = self._new_file(len(self.metadata.closed_files) + 1)
        self.metadata.close_file(ended)
        ended.close()
        self._begin()

    def end(self) -> None:
        """End the open file and metadata.yaml, in the room that was kept for it."""
        self._reserve.release()
        self._finish()
        self._write_metadata()

    def close(self) -> None:
        """Close the open file; a second call does nothing."""
        self.file.close()
        self._reserve.release()

    def hold_reserve(self) -> None:
        """Keep room on the disk for the end of the bag."""
        closing = self.file.closing_size(self.metadata.definitions_size)
        needed = _MARGIN + closing + 3 * self._text_size
        if needed > self._reserve.size:
            try:
                self._reserve.hold(2 * needed)
            except OSError:
                self._reserve.hold(needed)

    def _new_file(self, number: int) -> McapFile:
        return McapFile(self._folder / f'{self._folder.name}_{number}.mcap', self._compression)

    def _begin(self) -> None:
        """Write what is at the beginning of the open file."""
        self._synced = 0
        self._add_record()
        files.sync_folder(self._folder)
        self.stale = True
        self.flush()

    def _finish(self) -> None:
        if self.file.finished:
            return
        self.file.define(self.metadata.definitions.values())  # of topics without messages
        self._add_record()
        self.file.finish()
        self.file.sync()

    def _add_record(self) -> None:
        content = metadata.record_of(self.metadata.metadata(self.file))
        self.file.add_metadata(metadata.RECORD, content)

    def _write_metadata(self) -> None:
        text = metadata.text_of(self.metadata.metadata(self.file)).encode()
        self._text_size = len(text)
        files.write_whole(self._folder / metadata.FILE_NAME, text)
