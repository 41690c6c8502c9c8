// Text for metadata.

#ifndef GAFFEROSL_METAUTILS_H
#define GAFFEROSL_METAUTILS_H

#define MAKE_STR_OF(x) #x
#define MAKE_STR(x) MAKE_STR_OF(x)

#endif
