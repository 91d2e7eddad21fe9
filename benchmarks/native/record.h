/* The renderer's library with a recorder of its rays: what it exports beside the functions of sppm.h.
 *
 * While recording, every call of Embree's ray queries is noted, in order and for each thread apart. A replay traces the same rays in
 * the same calls through Embree alone. Record and replay while the scene that was rendered is alive. Nothing here is thread-safe but
 * the recorder itself.
 */
#ifndef SPPM_RECORD_H
#define SPPM_RECORD_H

#include <stdint.h>

#define RECORD_API __attribute__((visibility("default")))

#ifdef __cplusplus
extern "C" {
#endif

/* Forgets what was recorded and starts to record. */
RECORD_API void record_begin(void);
RECORD_API void record_end(void);
/* Rays that were recorded: intersections and shadow rays; a packet counts its active rays. */
RECORD_API void record_count(uint64_t *intersect, uint64_t *occluded);
/* Traces the recorded calls again, on this thread; the number of rays that hit, by which replays can be compared. */
RECORD_API uint64_t record_replay(void);

#ifdef __cplusplus
}
#endif

#endif
