"""Iterations of several sessions in turns, so that a busy machine hurts them alike."""

import statistics
import time


def in_turns(sessions, turns, clock=time.process_time, warm_up=1):
    """Seconds of each of `turns` iterations of each session, after `warm_up` that are not counted."""
    times = [[] for _ in sessions]
    for turn in range(warm_up + turns):
        order = list(zip(sessions, times))
        for session, own in order if turn % 2 else reversed(order):
            begin = clock()
            session.step()
            own.append(clock() - begin)
    return [own[warm_up:] for own in times]


def median_ratio(times, firsts):
    """Of times to those of the same turn."""
    return statistics.median(mine / first for mine, first in zip(times, firsts))
