"""Several machines on this one: network namespaces with a slow line between them."""
