"""Any laboratory recording as named channels with units: formats, channel maps, clocks, mounting of sensors, windows.

What other rooms use: :func:`tyre.channels.read.read_signals` (a file as :class:`~tyre.channels.signals.Signals`),
:func:`tyre.channels.read.contents` (its columns, without their values), :class:`~tyre.channels.channel_map.ChannelMap`
(which column is which channel), :func:`tyre.channels.draft.draft_map` (a first one, guessed from names and units) and
:func:`tyre.channels.record.read_records` (the channels in SI on one time base, one record an event).
"""
