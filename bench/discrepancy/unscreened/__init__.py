"""Effects that no screening holds: soft friction, schedules, what differs between records, outside forces."""
