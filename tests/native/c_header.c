/* The header must be C11. */
#include "sppm/sppm.h"

uint32_t sppm_abi_version_seen_from_c(void) { return SPPM_ABI_VERSION; }
