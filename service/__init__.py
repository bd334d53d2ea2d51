"""HTTP API, queue, worker slots, storage, client and command line of Penumbra."""
